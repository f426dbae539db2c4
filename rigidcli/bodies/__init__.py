"""What has mass: shapes and their densities, points, meshes, molecules, robots, and bodies of parts."""
