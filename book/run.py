"""Execute one chapter: the recipe of make; `driver/build/execute.py` says how."""

import os

# One thread a process, kernels included, and before NumPy or torch is imported.
os.environ |= {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

if __name__ == "__main__":
    from driver.build.execute import main

    main()
