"""Pages as a reader sees them: a Chromium without a window, asked over a pipe."""
