"""Starting configurations."""
