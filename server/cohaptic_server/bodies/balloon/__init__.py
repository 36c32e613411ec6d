"""The balloon, linear and of rubber: a membrane round a volume that stays."""
