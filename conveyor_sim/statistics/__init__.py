"""What runs show and what they can't: intervals, differences, warm-up, batch means, many comparisons. Arrays only."""
