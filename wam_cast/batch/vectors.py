"""Vectors and matrices by their elements, each an array over casts.

So every operation is elementwise over casts, and a compiler joins them to loops that run in a processor's vector registers.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

Element: TypeAlias = Any
"""An array over casts, shape (n,), or what is the same for all of them."""


class Vector(NamedTuple):
    """A vector."""

    x: Element
    y: Element
    z: Element

    def __add__(self, other: Any) -> Vector:
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: Vector) -> Vector:
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def __mul__(self, factor: Any) -> Vector:
        return Vector(self.x * factor, self.y * factor, self.z * factor)

    def dot(self, other: Vector) -> Element:
        """Return the inner product."""
        return self.x * other.x + self.y * other.y + self.z * other.z

    def cross(self, other: Vector) -> Vector:
        """Return the cross product."""
        return Vector(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )


class Matrix(NamedTuple):
    """A matrix by its columns."""

    x: Vector
    y: Vector
    z: Vector

    def __add__(self, other: Any) -> Matrix:
        return Matrix(self.x + other.x, self.y + other.y, self.z + other.z)

    def times(self, v: Vector) -> Vector:
        """Return the product with a vector."""
        product: Vector = self.x * v.x + self.y * v.y + self.z * v.z
        return product

    def of(self, other: Matrix) -> Matrix:
        """Return the product with a matrix."""
        return Matrix(*(self.times(column) for column in other))

    def transposed_times(self, v: Vector) -> Vector:
        """Return the product of the transpose with a vector."""
        return Vector(self.x.dot(v), self.y.dot(v), self.z.dot(v))

    @property
    def transposed(self) -> Matrix:
        """The transpose."""
        x, y, z = self
        return Matrix(Vector(x.x, y.x, z.x), Vector(x.y, y.y, z.y), Vector(x.z, y.z, z.z))

    def crossed(self, v: Vector) -> Matrix:
        """Return this matrix times the negative of the matrix of the cross product with `v`."""
        return Matrix(self.z * v.y - self.y * v.z, self.x * v.z - self.z * v.x, self.y * v.x - self.x * v.y)

    def minus_outer(self, a: Vector, b: Vector) -> Matrix:
        """Return this matrix less a b^T."""
        return Matrix(self.x - a * b.x, self.y - a * b.y, self.z - a * b.z)

    def congruent(self, symmetric: Symmetric) -> Symmetric:
        """Return R S R^T of a symmetric matrix S."""
        T = self.of(symmetric.matrix)

        def element(i: int, j: int) -> Element:
            return T.x[i] * self.x[j] + T.y[i] * self.y[j] + T.z[i] * self.z[j]

        return Symmetric(*(element(i, j) for i in range(3) for j in range(i, 3)))


class Symmetric(NamedTuple):
    """A symmetric matrix by its six elements."""

    xx: Element
    xy: Element
    xz: Element
    yy: Element
    yz: Element
    zz: Element

    @property
    def matrix(self) -> Matrix:
        """The same by its columns."""
        xx, xy, xz, yy, yz, zz = self
        return Matrix(Vector(xx, xy, xz), Vector(xy, yy, yz), Vector(xz, yz, zz))

    def __add__(self, other: Any) -> Symmetric:
        return Symmetric(*(a + b for a, b in zip(self, other, strict=True)))

    def __matmul__(self, v: Vector) -> Vector:
        return self.matrix.times(v)

    def minus_outer(self, a: Vector, b: Vector) -> Symmetric:
        """Return this matrix less a b^T, which must be symmetric, or become so with what else is taken off."""
        products = (a.x * b.x, a.x * b.y, a.x * b.z, a.y * b.y, a.y * b.z, a.z * b.z)
        return Symmetric(*(element - product for element, product in zip(self, products, strict=True)))
