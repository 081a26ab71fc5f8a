"""What pages show: tables, sentences and figures, made from runs and verdicts."""
