"""The `<inertial>` of a link in SDF: the tensor about the centre of mass, along the axes of the link."""

from rigidcli.render.inertial import block

piece = block("""<inertial>
  <pose>{x} {y} {z} 0 0 0</pose>
  <mass>{mass}</mass>
  <inertia>
    <ixx>{Ixx}</ixx>
    <ixy>{Ixy}</ixy>
    <ixz>{Ixz}</ixz>
    <iyy>{Iyy}</iyy>
    <iyz>{Iyz}</iyz>
    <izz>{Izz}</izz>
  </inertia>
</inertial>
""")
"""The block of a report: its products of inertia are entries of the tensor, -sum m x y, as SDF has them."""
