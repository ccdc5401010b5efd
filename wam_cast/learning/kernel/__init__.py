"""What kernel ridge regression is made of: its parameters, the kernel's matrix, and the approximation for many training inputs."""
