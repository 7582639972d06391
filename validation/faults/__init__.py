"""Files that remain if the program is killed or interrupted, or cannot write."""
