"""Contact of plates, obstacles, solids, films and cables: rounded points, edges and shapes."""
