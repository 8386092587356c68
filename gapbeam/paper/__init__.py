"""The paper that gapbeam grew from, computed again."""
