"""The tasks that workers are given: who does which, and for how long an answer is awaited."""
