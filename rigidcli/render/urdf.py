"""The `<inertial>` of a link in URDF: the tensor about the centre of mass, along the axes of the link."""

from rigidcli.render.inertial import block

piece = block("""<inertial>
  <origin xyz="{x} {y} {z}" rpy="0 0 0"/>
  <mass value="{mass}"/>
  <inertia ixx="{Ixx}" ixy="{Ixy}" ixz="{Ixz}" iyy="{Iyy}" iyz="{Iyz}" izz="{Izz}"/>
</inertial>
""")
"""The block of a report: its products of inertia are entries of the tensor, -sum m x y, as URDF has them."""
