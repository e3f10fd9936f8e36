"""Long campaigns: what is too slow for every commit."""
