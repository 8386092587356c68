"""What a run will cost, predicted from trials."""
