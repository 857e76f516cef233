"""The commands for any model: `jaxplan plan` and `jaxplan check`."""
