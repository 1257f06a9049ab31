"""From a step of a slider to its picture on the page of ``designer explore``, in Chromium.

For each of the paper's responses the slider of ω is moved within its window, a step at a time. A
time is from the event of the slider to the moment after the frame in which the plots were painted.
``DESIGNER_STEPS`` is the number of steps of each response (60).
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright

from benchmarks.bench_flow import commit, machine, table
from designer.explorer.controls import controls
from designer.explorer.place import OMEGA
from designer.model.model_file import read_model_file
from tests.explorer.served import EXAMPLES, served

MODEL = EXAMPLES / "paper.toml"
WINDOWS = {
    "1-1-1": (1.45, 1.70),
    "1-2-2": (0.82, 0.90),
    "1-3-3": (0.530, 0.550),
    "1-4-4": (0.404, 0.412),
    "1-5-5": (0.333, 0.340),
    "1-6-6": (0.281, 0.286),
    "1-7-7": (0.239, 0.243),
    "1-8-8": (0.2125, 0.2170),
}
"""Ends of ω within the window of each response."""
STEP = """
async (place) => {
  const slider = document.querySelector("[data-name=omega] .slider");
  const root = document.documentElement;
  const before = root.dataset.drawn;
  slider.value = place;
  slider.dispatchEvent(new Event("input"));
  while (root.dataset.drawn === before) await new Promise((done) => setTimeout(done, 1));
  return Number(root.dataset.latency);
}
"""


def times(page: Page, low: float, high: float, steps: int) -> np.ndarray:
    """(steps,) milliseconds of as many steps there and back between two frequencies."""
    (omega,) = (c for c in controls(read_model_file(MODEL)) if c.name == OMEGA)
    way = np.interp(np.linspace(0.0, 2.0, steps) % 1.0, [0.0, 1.0], np.log([low, high]))
    ends = np.log([omega.low, omega.high])
    places = np.round(2000.0 * (way - ends[0]) / (ends[1] - ends[0])).astype(int)
    return np.array([page.evaluate(STEP, int(place)) for place in places])


def main() -> str:
    """Measure and print a table; a line that sums it up."""
    steps = int(os.environ.get("DESIGNER_STEPS", "60"))
    rows, every = [], []
    with (
        tempfile.TemporaryDirectory() as folder,
        served(MODEL, Path(folder), "--port", "0") as address,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        page = browser.new_page(viewport={"width": 1300, "height": 950})
        page.goto(address)
        page.wait_for_selector("html[data-drawn]")
        page.wait_for_timeout(3000)
        for response, (low, high) in WINDOWS.items():
            times(page, low, high, 5)
            found = times(page, low, high, steps)
            every.append(found)
            rows.append([response, *(f"{np.percentile(found, q):.0f}" for q in (50, 95, 100))])
        browser.close()
    both = np.percentile(np.concatenate(every), [50, 95])
    load = os.getloadavg()[0]
    print(f"commit {commit()}, {machine()}, load {load:.1f}; {steps} steps each, ms\n")
    print("\n".join(table(["response", "median", "95th percentile", "longest"], rows)))
    return f"median {both[0]:.0f} ms, 95th percentile {both[1]:.0f} ms"


if __name__ == "__main__":
    print(main())
