"""Every place meets the rules of axe-core: in both languages and themes, on phones and desks."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from steps import LOAD_MS, flock_canvas, get, said, settle, until
from test_without import places

AXE = Path(__file__).parents[2] / "target/web/node_modules/axe-core/axe.min.js"
SIZES = {"phone": {"width": 390, "height": 844}, "desk": {"width": 1440, "height": 900}}
# What hinders a person; axe's advice of other kinds is not asked for.
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
# What a bar covers that stays in sight can be scrolled from below it, which axe does not know.
UNSTICK = """for (const one of document.querySelectorAll("body *")) {
    if (getComputedStyle(one).position === "sticky") one.style.position = "static";
}"""
RUN = """(tags) => axe.run(document, { runOnly: tags, resultTypes: ["violations"] }).then(({ violations }) =>
    violations.map(({ id, nodes }) => id + ": " + nodes.map(({ target, any }) => target.join(" ") + (any[0] ? " (" + any[0].message + ")" : "")).join(" | ")))"""
# Faults of Swagger UI itself: its tags are headings of the third level, and its rows are buttons with links in them.
SWAGGER_FAULTS = ("heading-order", "nested-interactive")
NAMES = ["home", "films", "film", "desk", "studio", "reel", "flocks", "jobs"]


def is_ready(page, name):
    """Waits until a place shows its data."""
    if name in ("home", "film", "studio"):
        expect(flock_canvas(page)).to_be_visible(timeout=LOAD_MS)
    if name == "desk":
        until(page, "document.querySelector('#place').dataset.loaded === 'true'", LOAD_MS / 1000)
    settle(page)


def violations(page):
    # The page's policy does not apply to scripts of a test.
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.read_text())
    page.evaluate(UNSTICK)
    return page.evaluate(RUN, RULES)


@pytest.mark.parametrize("locale", ["en", pytest.param("ja", marks=pytest.mark.thorough)])
@pytest.mark.parametrize("name", [*NAMES, "missing"])
def test_no_violations(visitor, filled_service, name, locale):
    assert AXE.is_file(), "axe-core is missing: run `make vendor`"
    page = visitor(locale=locale, reduced_motion="reduce", viewport=SIZES["desk"])
    page.goto(dict(zip(NAMES, places(filled_service), strict=True)).get(name, f"{filled_service}/films/nothing"))
    is_ready(page, name)
    found = {}
    for size, viewport in SIZES.items():
        page.set_viewport_size(viewport)
        for theme in ("light", "dark"):
            page.emulate_media(color_scheme=theme, reduced_motion="reduce")
            for one in violations(page):
                found.setdefault(one, []).append(f"{size} {theme}")
    assert found == {}


@pytest.mark.parametrize("state", ["tray", "details", "desk editor", "film editor"])
def test_no_violations_in_what_opens(visitor, filled_service, state):
    page = visitor(reduced_motion="reduce")
    addresses = dict(zip(NAMES, places(filled_service), strict=True))
    name = {"tray": "films", "details": "studio", "desk editor": "desk", "film editor": "film"}[state]
    page.goto(addresses[name])
    is_ready(page, name)
    if state == "tray":
        page.locator("#tray-button").click()
    elif state == "details":
        page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    else:
        page.locator("#measure-again, #change-settings").click()
        page.locator(".editor summary").click()
    for viewport in SIZES.values():
        page.set_viewport_size(viewport)
        for theme in ("light", "dark"):
            page.emulate_media(color_scheme=theme, reduced_motion="reduce")
            assert violations(page) == []


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_no_violations_in_the_description_of_the_api(visitor, filled_service, theme):
    page = visitor(color_scheme=theme, viewport=SIZES["desk"])
    page.goto(f"{filled_service}/docs")
    call = page.locator(".opblock", has_text="/readyz").first
    expect(call).to_be_visible(timeout=LOAD_MS)
    call.locator(".opblock-summary-control").click()
    expect(call.locator(".opblock-body")).to_be_visible()
    assert [one for one in violations(page) if not one.startswith(SWAGGER_FAULTS)] == []


def test_canvas_says_what_swims_on_it(page, filled_service):
    flock = get(f"{filled_service}/v1/flocks")["items"][-1]
    for path, n in (("/studio?count=1&frames=30", 1), (f"/flocks/{flock['id']}?t=1&view=living", flock["count"])):
        page.goto(filled_service + path)
        name = re.compile(f"{said(page, 'living.n', n=n).pattern}, .+, .+")
        expect(flock_canvas(page)).to_have_accessible_name(name, timeout=LOAD_MS)
