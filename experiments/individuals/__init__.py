"""Towns that try whether an agent tells individuals apart, each as the module `sim`."""
