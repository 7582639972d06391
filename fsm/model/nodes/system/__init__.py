"""Systems of meshes: builder, matrices, compiled model, vibration in few modes."""
