"""Files that are written whole or not at all, and the directories of datasets and runs."""
