"""The answers to `exercises/01_hand_kinematics.ipynb`."""

import numpy as np


def hand_position(q, lengths):
    angles = np.cumsum(q)  # of the links from the vertical: a joint turns all that hangs below it
    return np.array([lengths @ np.sin(angles), -lengths @ np.cos(angles)])


def hand_jacobian(q, lengths):
    angles = np.cumsum(q)
    moved = lengths * np.array([np.cos(angles), np.sin(angles)])  # by each link's angle
    return np.cumsum(moved[:, ::-1], axis=1)[:, ::-1]  # a joint moves its own link and all below it


def joint_torques(J, force):
    return J.T @ force


def null_space_torque(J, torque):
    return torque - J.T @ np.linalg.solve(J @ J.T, J @ torque)


def hand_law(J, position_error, velocity_error, kp, kd):
    return joint_torques(J, kp * position_error + kd * velocity_error)
