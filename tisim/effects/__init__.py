"""Forces and impact laws, one file each."""
