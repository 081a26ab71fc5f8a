"""From runs to numbers, without a verdict: metrics, summaries, statistics, and searches."""
