"""What a running server tells those who look after it: metrics, health, and a page of state."""
