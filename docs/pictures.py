"""Make the pictures of the README and of the front page from report pages, by the browser that the tests use.

python docs/pictures.py [NAME...]    # report measured models plan: which; all if none is named
"""

import io
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from PIL import Image, ImageOps

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "python" / "support"))

from browser import started_browser  # noqa: E402
from jointfrf.workbench.cli.main import main  # noqa: E402


class Picture(NamedTuple):
    """Parts of the report of a command, in columns."""

    path: str
    command: str
    columns: dict[int, list[str]]  # width in pixels: selectors
    hidden: str = ".none"


IDENTIFY = "identify cases/hammer-test/two_bars.uff --j 101,102 --k 201,202 --dofs y,rz --bending-stiffness 2362.5"
MODEL = "identify cases/four-mounts/test.uff --model cases/four-mounts/assembly.toml"
PLAN = "plan cases/lap-beam/assembly.toml --band 20:1000 --step 2 --noise 0.02 --floor 0.01 --budget 5"
PICTURES = {
    "report": Picture(
        "docs/report.png",
        IDENTIFY,
        {
            560: ["h1", ".about", "#summary ~ ul.words", "#parameters + table", "#sketch"],
            440: ["#summary ~ .charts .chart", "#joint_y"],
        },
        "#joint_y .panel:nth-child(n+3)",
    ),
    "measured": Picture("docs/static/measured.png", IDENTIFY, {400: ["#frf-4 .panels"]}),
    "models": Picture("docs/static/models.png", MODEL, {400: ["#assembly"]}),
    "plan": Picture("docs/static/plan.png", PLAN, {400: ["#plan-cost img, #plan-cost svg"]}),
}
#: Leave only the parts of the page that are shown, side by side.
ARRANGE = """([columns, hidden]) => {
    const frame = document.createElement('main');
    frame.style.cssText = 'display: flex; gap: 40px; padding: 16px; width: max-content; max-width: none; margin: 0';
    for (const [width, selectors] of Object.entries(columns).reverse()) {
        const column = document.createElement('div');
        column.style.width = `${width}px`;
        for (const selector of selectors) {
            const found = document.querySelector(selector);
            if (!found) throw new Error(`no ${selector} in the page`);
            column.append(found);
        }
        frame.append(column);
    }
    document.body.replaceChildren(frame);
    document.body.style.cssText = 'margin: 0; padding: 0; max-width: none; width: max-content';
    const unseen = `.tools, .readout, .sketch figcaption, ${hidden}`;
    document.querySelectorAll(unseen).forEach(element => element.remove());
    document.querySelectorAll('img').forEach(element => element.style.cssText = 'width: 100%; height: auto');
    document.querySelectorAll('figcaption').forEach(element => element.style.cssText = 'max-width: none; padding: 0');
}"""


def make(picture: Picture, browser: object, folder: Path) -> None:
    """Run the command, and write the picture of parts of its report."""
    report = folder / "report.html"
    words = [str(ROOT / word) if word.startswith("cases/") else word for word in picture.command.split()]
    main([*words, "--report", str(report), "--quiet"])
    page = browser.new_context(viewport={"width": 1000, "height": 900}, device_scale_factor=1.5).new_page()
    page.goto(report.as_uri())
    page.evaluate(ARRANGE, [picture.columns, picture.hidden])
    shot = Image.open(io.BytesIO(page.locator("main").screenshot())).convert("RGB")
    left, top, right, bottom = ImageOps.invert(shot).getbbox()  # without white margins
    shot.crop((left - 9, top - 9, right + 9, bottom + 9)).quantize(64).save(ROOT / picture.path, optimize=True)


if __name__ == "__main__":
    with started_browser() as started, tempfile.TemporaryDirectory() as made:
        for name in sys.argv[1:] or PICTURES:
            make(PICTURES[name], started, Path(made))
