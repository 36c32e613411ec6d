"""WoodenHaptics, Polhem and vintage Phantoms on their boards: serial, and three kinds of HID."""
