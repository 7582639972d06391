"""Contact of rounded points, edges and faces with rigid shapes."""
