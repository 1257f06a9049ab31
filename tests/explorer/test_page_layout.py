"""Where things stand on the page, on a desk and on a phone, and what has a unit."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from tests.explorer.opened_page import check_labels, chromium, opened
from tests.explorer.served import EXAMPLES, served

pytestmark = pytest.mark.browser
SIZES = {400: 800, 800: 900, 1280: 900}
"""Height of the window by its width."""
MODELS = ("paper", "rig", "three-masses")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as each:
        yield each


@pytest.fixture(scope="module")
def addresses(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    folder = tmp_path_factory.mktemp("layout")
    with (
        served(EXAMPLES / "paper.toml", folder, "--port", "0") as paper,
        served(EXAMPLES / "rig.toml", folder, "--port", "0") as rig,
        served(EXAMPLES / "three-masses.toml", folder, "--port", "0") as three,
    ):
        yield dict(zip(MODELS, (paper, rig, three), strict=True))


def of_width(browser: Browser, address: str, width: int, **options: object) -> Page:
    return opened(browser, address, viewport={"width": width, "height": SIZES[width]}, **options)


def box(page: Page, selector: str) -> dict[str, float]:
    return page.evaluate(  # type: ignore[no-any-return]
        "selector => document.querySelector(selector).getBoundingClientRect().toJSON()", selector
    )


@pytest.mark.parametrize("width", SIZES)
def test_the_figures_stand_beside_the_portrait_or_right_below_it(
    browser: Browser, addresses: dict[str, str], width: int
) -> None:
    page = of_width(browser, addresses["paper"], width)
    plot, figures = box(page, "#portrait"), box(page, "#facts")
    if width == 1280:
        assert 0.0 <= figures["left"] - plot["right"] < 40.0
        assert figures["top"] < plot["top"] + 40.0
    else:
        assert 0.0 <= figures["top"] - plot["bottom"] < 40.0
    assert figures["top"] < SIZES[width]
    page.close()


@pytest.mark.parametrize(
    ("width", "height"),
    [*SIZES.items(), (400, 745)],  # the last cut half a pixel of a slider at its lower edge
)
def test_each_slider_and_the_portrait_are_in_sight_together(
    browser: Browser, addresses: dict[str, str], width: int, height: int
) -> None:
    """Whichever has the focus: both are whole in the window, and nothing lies over the slider."""
    page = of_width(browser, addresses["three-masses"], width)
    page.set_viewport_size({"width": width, "height": height})
    seen = page.evaluate(
        """async () => {
          const out = [], whole = (r) => r.top >= 0 && r.bottom <= innerHeight && r.height > 10;
          for (const slider of document.querySelectorAll(".slider")) {
            slider.focus();
            await new Promise((done) => requestAnimationFrame(() => setTimeout(done, 20)));
            const r = slider.getBoundingClientRect();
            const plot = document.getElementById("portrait").getBoundingClientRect();
            const over = [r.top + 2, r.bottom - 2].map((y) =>
              document.elementFromPoint((r.left + r.right) / 2, y) === slider);
            out.push([slider.closest(".control").dataset.name, whole(r), whole(plot), ...over]);
          }
          return out;
        }"""
    )
    assert len(seen) == 22
    for name, *in_sight in seen:
        assert all(in_sight), name
    before = page.evaluate("() => document.documentElement.dataset.drawn")
    page.keyboard.press("ArrowRight")
    page.wait_for_function("n => document.documentElement.dataset.drawn !== n", arg=before)
    page.select_option("#shown", index=1)
    page.wait_for_function("() => new URLSearchParams(location.search).get('shown') === '1'")
    page.close()


def test_on_a_phone_no_slider_jumps_away_while_the_figures_change(
    browser: Browser, addresses: dict[str, str]
) -> None:
    """To chaos, which has fewer figures, and to many impacts, which have more."""
    page = of_width(browser, addresses["paper"], 400)
    page.focus("[data-name=omega] .slider")
    page.mouse.wheel(0, 60)
    page.wait_for_function("() => scrollY > 400")
    top, heights = box(page, "[data-name=omega]")["top"], []
    for omega, response in (("0.62", "aperiodic"), ("0.85", "1-2-2"), ("0.24", "1-7-7")):
        page.evaluate(  # what types it by the browser scrolls, too
            """omega => { const field = document.querySelector("[data-name=omega] .number");
              field.value = omega;
              field.dispatchEvent(new Event("change")); }""",
            omega,
        )
        page.wait_for_function(
            "text => document.getElementById('summary').textContent.startsWith(text)", arg=response
        )
        page.wait_for_timeout(200)
        assert box(page, "[data-name=omega]")["top"] == pytest.approx(top, abs=1.0), response
        check_figures_in_sight(page, response)
        heights.append(box(page, "#facts dl")["height"])
    assert heights[0] < heights[1]
    page.close()


def check_figures_in_sight(page: Page, response: str) -> None:
    """Response, largest multiplier and exponent are whole above the portrait, as the list says."""
    figures = dict(
        page.evaluate(
            """() => [...document.querySelectorAll("#facts dt")].map((each) =>
              [each.innerText, each.nextElementSibling.innerText])"""
        )
    )
    shown = [n for n in ("largest |μ|", "λ max") if n in figures]
    assert len(shown) == (1 if response == "aperiodic" else 2)
    assert page.inner_text("#in-sight") == ", ".join(f"{n} = {figures[n]}" for n in shown)
    head, line, plot = (box(page, each) for each in ("#summary", "#in-sight", "#portrait"))
    assert 0.0 <= head["top"] < head["bottom"] <= line["top"]
    assert line["bottom"] <= plot["top"]
    (cut,) = page.evaluate(
        "() => [document.querySelector('#in-sight')].map((e) => e.scrollWidth > e.clientWidth)"
    )
    assert not cut


def test_a_finger_on_a_plot_moves_the_page(browser: Browser, addresses: dict[str, str]) -> None:
    page = of_width(browser, addresses["paper"], 400, has_touch=True, is_mobile=True)
    plot, touch = box(page, "#portrait"), page.context.new_cdp_session(page)
    x, y = plot["left"] + 200.0, plot["bottom"] - 60.0
    for k in range(12):
        points = [{"x": x, "y": y - 10.0 * k}]
        kind = "touchMove" if k else "touchStart"
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        page.wait_for_timeout(20)
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait_for_function("() => scrollY > 50")
    page.close()


def test_the_keyboard_stops_at_nothing_without_a_name(
    browser: Browser, addresses: dict[str, str]
) -> None:
    page = of_width(browser, addresses["paper"], 1280)
    page.focus("#shown")
    stops = []
    for _ in range(40):
        page.keyboard.press("Tab")
        stops.append(
            page.evaluate(
                """() => { let at = document.activeElement;
                  while (at.shadowRoot?.activeElement) at = at.shadowRoot.activeElement;
                  const label = at.ariaLabel ?? at.labels?.[0]?.textContent;
                  return label ?? (at.title || at.textContent); }"""
            )
        )
    assert all(text.strip() for text in stops), stops
    assert "damping ζ, slider" in stops
    page.close()


@pytest.mark.parametrize("width", SIZES)
@pytest.mark.parametrize(
    ("model", "place"),
    [
        ("paper", ""),
        ("paper", "?omega=0.62&b=0.0003"),
        ("paper", "?omega=0.199461&b=0.0681039"),  # a label at the corner of the diagram
        ("rig", ""),
        ("rig", "?omega=42.7256600888"),
        ("three-masses", "?shown=2"),
    ],
)
def test_no_label_of_a_plot_is_cut_or_meets_another(
    browser: Browser, addresses: dict[str, str], model: str, place: str, width: int
) -> None:
    page = of_width(browser, addresses[model] + place, width)
    check_labels(page, 3)
    page.close()


def test_labels_of_the_map_are_whole_on_a_phone(
    browser: Browser, addresses: dict[str, str]
) -> None:
    map_over = "?map=omega~60~120~carriage-ground.damping~3~12"
    page = of_width(browser, addresses["rig"] + map_over, 400)
    page.wait_for_selector("#map-box:not([hidden])")
    labels = check_labels(page, 4)
    assert "carriage-ground.damping [N s/m]" in labels
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 400
    page.focus("#map")
    page.keyboard.press("ArrowRight")
    told = page.inner_text("#map-at")
    assert " Hz, carriage-ground.damping = " in told
    assert " N s/m: " in told
    page.close()


def test_si_values_have_their_units_everywhere(browser: Browser, addresses: dict[str, str]) -> None:
    page = of_width(browser, addresses["rig"], 1280)
    labels = check_labels(page, 3)
    assert {"x₁ [mm]", "x₁′ [mm/s]", "time [drive periods]"} <= labels
    assert {"least x₁ [mm]", "drive frequency [Hz]"} <= labels
    units = page.evaluate(
        """() => Object.fromEntries([...document.querySelectorAll(".control")].map((each) =>
          [each.dataset.name, each.querySelector(".unit").innerText]))"""
    )
    assert units.pop("b") == ""  # a factor
    assert units["carriage.amplitude"] == "N"
    assert units["carriage-ground.damping"] == "N s/m"
    assert all(units.values())
    figures = dict(
        page.evaluate(
            """() => [...document.querySelectorAll("#facts dt")].map((each) =>
              [each.innerText, each.nextElementSibling.innerText])"""
        )
    )
    for name in ("x₁ (carriage)", "shallowest contact", "nearest miss"):
        assert figures[name].endswith(" mm")
    assert figures["λ max"].endswith(" 1/s")
    assert figures["upper stop"].startswith("3 impacts, x₁′")
    assert figures["upper stop"].endswith(" mm/s")
    assert page.inner_text("#map-x-unit") == "Hz"
    page.select_option("#map-y", "buffers.upper")
    assert page.inner_text("#map-y-unit") == "mm"
    page.close()


@pytest.mark.parametrize(
    ("model", "words"),
    [("paper", "dimensionless"), ("three-masses", "in the units of the model file")],
)
def test_numbers_without_units_are_explained_once(
    browser: Browser, addresses: dict[str, str], model: str, words: str
) -> None:
    page = of_width(browser, addresses[model], 1280)
    assert page.inner_text("body").count(words) == 1
    page.close()
