"""What a search has learnt beside the best design: how well genes are known, and which of them matter."""
