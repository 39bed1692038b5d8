"""What the nodes share: how they start, talk, take parameters and end."""
