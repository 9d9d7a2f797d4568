"""The finished film in the studio and elsewhere: its buttons, and links to it."""

import re

from playwright.sync_api import expect

from steps import LONG_MS, fetch, get, heading, open_tray, say, until

CLIPBOARD = "navigator.clipboard.readText()"


def test_one_click_copies_a_link_to_the_finished_film(visitor, filled_service):
    page = visitor(permissions=["clipboard-read", "clipboard-write"])
    page.goto(f"{filled_service}/studio?count=2&frames=24&seed=3&render.background=transparent&render.formats=[%22webm%22]")
    page.get_by_role("button", name=say(page, "make.film")).click()
    panel = page.locator(".studio-panel")
    panel.get_by_role("button", name=say(page, "link.copy")).click(timeout=LONG_MS)
    link = until(page, CLIPBOARD)
    with page.expect_download() as download:
        panel.get_by_role("link", name=say(page, "job.download")).click()
    assert download.value.suggested_filename.endswith(".webm")

    page.evaluate("navigator.clipboard.writeText('')")
    tray = open_tray(page)
    expect(tray.get_by_role("link", name=say(page, "job.download")).first).to_be_visible()
    tray.get_by_role("button", name=say(page, "link.copy")).first.click()
    until(page, lambda: page.evaluate(CLIPBOARD).startswith(f"{filled_service}/s/"))

    friend = visitor()
    friend.goto(link)
    expect(heading(friend)).to_contain_text(re.compile("^2 × goldfish"))
    expect(friend).to_have_title(re.compile("^2 × goldfish .*, .* · flockreel$"))
    # The friend sees that the film is transparent.
    expect(friend.locator(".stage.is-clear video")).to_have_attribute("src", re.compile("video.webm"))
    clear = friend.get_by_role("link", name=say(friend, "shared.save_clear", format="WebM"))
    assert fetch(filled_service + clear.get_attribute("href"))[:4] == b"\x1aE\xdf\xa3"


def test_the_end_of_a_film_and_a_copied_link_move_no_button(visitor, filled_service):
    page = visitor(permissions=["clipboard-read", "clipboard-write"])
    page.goto(f"{filled_service}/studio?count=2&frames=24&seed=4")
    panel = page.locator(".studio-panel")
    make, wait = panel.get_by_role("button", name=say(page, "make.film")), panel.get_by_text(say(page, "make.wait"))
    # Nothing but the film's own link can be sent by mistake.
    expect(panel.get_by_role("button", name=re.compile("link", re.I))).to_have_count(0)
    make.click()
    expect(wait).to_be_visible(timeout=LONG_MS)
    before = make.bounding_box()
    copy, save = panel.get_by_role("button", name=say(page, "link.copy")), panel.get_by_role("link", name=say(page, "job.download"))
    expect(copy).to_be_visible(timeout=LONG_MS)
    assert make.bounding_box() == before
    told = panel.get_by_text(say(page, "link.lasts"))
    places = [one.bounding_box() for one in (make, save, told)]
    copy.click()
    expect(panel.get_by_role("button", name=say(page, "share.copied"))).to_be_visible()
    assert [one.bounding_box() for one in (make, save, told)] == places


def test_a_link_is_copied_where_the_browser_has_no_clipboard(page, filled_service):
    page.add_init_script("Object.defineProperty(navigator, 'clipboard', { value: undefined });")
    flock = get(f"{filled_service}/v1/flocks")["items"][0]
    page.goto(f"{filled_service}/flocks/{flock['id']}")
    copy = page.get_by_role("button", name=say(page, "link.copy"))
    copy.click(timeout=LONG_MS)
    expect(page.get_by_role("button", name=say(page, "share.copied"))).to_be_focused()
