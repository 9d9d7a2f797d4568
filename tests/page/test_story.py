"""The story of a film, from the file to the film of its flock: by pointer, by keys, and in Japanese."""

import re

import pytest
from playwright.sync_api import expect

from steps import LONG_MS, choose_film, expect_playing, expect_swimming, get, heading, make_film_in_studio, said, say, settle, until


def small_flock(page):
    """Asks the studio for few animals and a short film."""
    page.goto(re.sub(r"\?.*|$", "?count=3&frames=30", page.url, count=1))
    expect_swimming(page)


def test_a_film_becomes_a_flock_that_swims_and_a_film_that_plays_and_downloads(page, empty_service, other_film):
    page.goto(empty_service)
    choose_film(page, other_film)
    expect(page).to_have_url(re.compile(r"/films/[0-9a-f-]{36}"), timeout=LONG_MS)
    expect(page).to_have_title(re.compile(f"^{other_film.stem} "))
    expect(page.get_by_text(say(page, "film.flock"))).to_be_visible(timeout=LONG_MS)
    expect_swimming(page)

    page.get_by_role("link", name=say(page, "film.studio")).click()
    expect(page).to_have_url(re.compile("/studio"))
    expect(page).to_have_title(said(page, "studio.title", film=other_film.stem))
    small_flock(page)
    flock = make_film_in_studio(page)
    expect_playing(page, page.locator("video").first)
    assert get(f"{empty_service}/v1/flocks/{flock}")["count"] == 3

    with page.expect_download() as download:
        page.get_by_role("row").filter(has_text="video.mp4").get_by_role("link").first.click()
    assert download.value.path().read_bytes()[4:8] == b"ftyp"
    name = download.value.suggested_filename
    assert other_film.stem in name and name.endswith(".mp4") and flock not in name, name
    page.get_by_role("link", name=re.compile("flockreel")).first.click()
    expect(page.get_by_role("main").get_by_role("link", name=re.compile(other_film.stem))).to_be_visible()


def tab_to(page, name, most=120):
    """Presses Tab until the element with this name has the focus."""
    for _ in range(most):
        page.keyboard.press("Tab")
        if page.evaluate(FOCUSED) == name:
            return
    raise AssertionError(f"Tab never reached {name!r}")


FOCUSED = """(() => {
    const node = document.activeElement;
    return (node.getAttribute("aria-label") || node.labels?.[0]?.innerText || node.textContent).trim();
})()"""


def test_the_whole_story_by_keys(page, empty_service, other_film):
    # A listener that is added right before the key is at times too late for the browser.
    choosers = []
    page.on("filechooser", lambda chooser: choosers.append(chooser))
    page.goto(empty_service)
    page.keyboard.press("Tab")
    assert page.evaluate(FOCUSED) == say(page, "skip")
    page.keyboard.press("Enter")
    tab_to(page, say(page, "home.choose"))
    page.keyboard.press("Enter")
    until(page, lambda: choosers)
    choosers[0].set_files(str(other_film))
    expect(heading(page)).to_have_text(other_film.stem, timeout=LONG_MS)
    expect(heading(page)).to_be_focused()
    expect(page.get_by_text(say(page, "film.flock"))).to_be_visible(timeout=LONG_MS)
    tab_to(page, say(page, "film.studio"))
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("/studio"))
    expect_swimming(page)
    expect(heading(page)).to_be_focused()

    shorten = page.get_by_role("spinbutton", name=say(page, "set.frames"))
    shorten.focus()
    page.keyboard.press("Control+a")
    page.keyboard.type("1")
    page.keyboard.press("Tab")
    tab_to(page, say(page, "make.film"))
    page.keyboard.press("Enter")
    expect(page.get_by_role("link", name=say(page, "make.open"))).to_be_visible(timeout=LONG_MS)
    tab_to(page, say(page, "make.open"))
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("/flocks/"))
    expect(heading(page)).to_be_focused()
    video = page.locator("video").first
    expect_playing(page, video)
    page.keyboard.press("Space")
    until(page, lambda: video.evaluate("(video) => video.paused"))


# Words that are the same in Japanese: names, units, formats, and what stands in code.
SAME = re.compile(r"flockreel|web|video|curl|python|api|english|couzin|rerun|webm|mov|prores|png|gif|webp|coco|mot|mp4|json|csv|svg|npy|numpy|zip|plan|poster|fps|px|kb|mb|gb|seed|esc|ctrl|shift|space|home|end|pandas|html|http|https|url|minnow|libraries|studio|flocks", re.I)
TEXT = """() => {
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const found = [];
    while (walker.nextNode()) {
        const node = walker.currentNode;
        if (!node.parentElement.closest("script, style, noscript, pre, code, [lang=en], [translate=no]")) found.push(node.textContent);
    }
    for (const node of document.querySelectorAll("[aria-label], [title], [placeholder], [alt]")) {
        for (const name of ["aria-label", "title", "placeholder", "alt"]) found.push(node.getAttribute(name) ?? "");
    }
    return found;
}"""


def english_of(page):
    """Returns English words that the page shows or names."""
    texts = [re.sub(r"\S+\.\w{2,5}\b|[0-9a-f]{8}-[0-9a-f-]{27}|https?://\S+", " ", text) for text in page.evaluate(TEXT)]
    words = {word for text in texts for word in re.findall(r"[A-Za-z]{3,}", text)}
    return sorted(word for word in words if not SAME.fullmatch(word))


def test_the_whole_story_in_japanese_has_no_english(visitor, empty_service, other_film):
    page = visitor(locale="ja-JP")
    page.goto(empty_service)
    until(page, "document.documentElement.lang === 'ja'")
    settle(page)
    assert english_of(page) == []
    choose_film(page, other_film)
    expect(page).to_have_url(re.compile("/films/"), timeout=LONG_MS)
    assert english_of(page) == []
    expect(page.get_by_text(say(page, "film.flock"))).to_be_visible(timeout=LONG_MS)
    assert english_of(page) == []
    page.get_by_role("link", name=say(page, "film.desk")).click()
    until(page, "document.querySelector('#place').dataset.loaded === 'true'")
    assert english_of(page) == []
    page.get_by_role("link", name=say(page, "film.studio")).click()
    expect_swimming(page)
    assert english_of(page) == []
    small_flock(page)
    make_film_in_studio(page)
    expect_playing(page, page.locator("video").first)
    assert english_of(page) == []
    for place, title in (("/films", "films.title"), ("/flocks", "reels.title"), ("/jobs", "jobs.title"), ("/films/nothing", "missing.title")):
        page.goto(empty_service + place)
        expect(heading(page)).to_have_text(say(page, title))
        settle(page)
        assert english_of(page) == [], place


@pytest.mark.parametrize(("locale", "language"), [("fr-FR", "en"), ("ja", "ja")])
def test_the_language_follows_the_browser_until_one_is_chosen(visitor, empty_service, locale, language):
    page = visitor(locale=locale)
    page.goto(empty_service)
    heading(page).wait_for()
    assert page.evaluate("document.documentElement.lang") == language
    other = {"en": "ja", "ja": "en"}[language]
    page.get_by_role("button", name={"en": "English", "ja": "日本語"}[other]).click()
    until(page, f"document.documentElement.lang === '{other}'")
    page.reload()
    heading(page).wait_for()
    assert page.evaluate("document.documentElement.lang") == other
