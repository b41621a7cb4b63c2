"""What every package may use: files from outside, foreign text, signals, progress, the machine and its resources."""
