"""Coverage-guided fuzzing by atheris, a target for every decoder and every reader."""
