"""The jobs of job.sh as Ray tasks: python ray_jobs.py synth 8"""

import argparse
import os
import pathlib
import subprocess

import ray

SETTINGS = ["TEMPLATE", "TEMPLATES", "COUNT", "SEED", "MINUTES", "MODEL", "VIDEOS", "CAMERA", "OUT", "DEEPSFT_BIN"]


@ray.remote(num_cpus=2, max_retries=2, retry_exceptions=[subprocess.CalledProcessError])
def job(script, settings, kind, number, of):
    """Runs one job on whatever machine Ray chooses; all machines see the same folders."""
    subprocess.run([script, kind, str(number), str(of)], env={**os.environ, **settings}, check=True)
    return number


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=["synth", "train", "track"])
    parser.add_argument("jobs", type=int)
    arguments = parser.parse_args()
    script = str(pathlib.Path(__file__).resolve().with_name("job.sh"))
    settings = {name: os.environ[name] for name in SETTINGS if name in os.environ}
    ray.init()  # the cluster of RAY_ADDRESS, else this machine alone
    running = [job.remote(script, settings, arguments.kind, n, arguments.jobs) for n in range(1, arguments.jobs + 1)]
    while running:
        done, running = ray.wait(running)
        print(f"job {ray.get(done[0])} is done, {len(running)} to go", flush=True)


if __name__ == "__main__":
    main()
