"""What pages get that watch: one scene a tick, encoded once for all of them."""
