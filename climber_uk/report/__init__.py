"""`analyze_bag`, `compare_bags` and `export_tum`: runs as numbers, figures and a page."""
