"""Principal axes: pairs of moments and axes, judged by the eigenvalue problem."""
