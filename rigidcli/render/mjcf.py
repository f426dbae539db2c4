"""The `<inertial>` of a body in MJCF: the tensor about the centre of mass, along the axes of the body."""

from rigidcli.render.inertial import block

piece = block(
    '<inertial pos="{x} {y} {z}" mass="{mass}" fullinertia="{Ixx} {Iyy} {Izz} {Ixy} {Ixz} {Iyz}"/>\n'
)
"""The block of a report: its products of inertia are entries of the tensor, -sum m x y, as MJCF has them."""
