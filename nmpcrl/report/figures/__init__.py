"""One function per figure: from records to a matplotlib Figure. The only home of matplotlib."""
