"""Campaign `hands`: thousands of random rooms, and which of them are unstable, slow or soft."""
