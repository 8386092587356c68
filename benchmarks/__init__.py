"""Speed and accuracy, measured side by side with what one would do without gapbeam."""
