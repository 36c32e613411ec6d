"""The lag that two moving hands need, by several stability criteria."""
