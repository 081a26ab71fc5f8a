"""Build the book: `driver/build/book.py` says how."""

import os

# One thread a process, kernels included, and before NumPy or torch is imported.
os.environ |= {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

from driver.build.book import main

if __name__ == "__main__":
    main()
