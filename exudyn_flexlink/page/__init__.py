"""The report of a run as one page of HTML, which loads nothing: for a browser, a phone, a printer.

`page_of` takes all it tells from a `Result`: figures of `plots`, tables of `report`. Templates only
say where each stands; nothing is computed in them.
"""

from exudyn_flexlink.page.contents import PAGE, is_page, page_of, write_page
