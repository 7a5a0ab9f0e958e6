"""What `make demo` and `make demo-cheetah` show: a policy carried to a robot it fails on."""
