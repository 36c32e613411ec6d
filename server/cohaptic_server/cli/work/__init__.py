"""What commands do once their options are read; imported only then, so that help comes at once."""
