"use strict";
// The table sorts and filters; a whisk's card opens from any link to it; arrow keys go from card to card.
(function () {
  const table = document.getElementById("table"), body = table.tBodies[0];
  const rows = Array.from(body.rows), heads = Array.from(table.tHead.rows[0].cells);

  function valueOf(row, column) {
    const cell = row.cells[column];
    if (!("v" in cell.dataset)) return cell.textContent.trim();
    return cell.dataset.v === "" ? null : Number(cell.dataset.v);
  }

  function compare(a, b) {
    if (typeof a === "number" && typeof b === "number") return a - b;
    return String(a).localeCompare(String(b), "en", { numeric: true });
  }

  function sortBy(column) {
    const head = heads[column], down = head.getAttribute("aria-sort") === "ascending";
    heads.forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const known = rows.filter((row) => valueOf(row, column) !== null);
    const missing = rows.filter((row) => valueOf(row, column) === null);
    known.sort((a, b) => (down ? -1 : 1) * compare(valueOf(a, column), valueOf(b, column)));
    body.append(...known, ...missing); // what is missing stands last, either way
  }
  heads.forEach((head, column) => head.querySelector("button").addEventListener("click", () => sortBy(column)));

  function markScrolling() { // what is wider than its place says that it scrolls
    for (const one of document.querySelectorAll(".scroll, pre")) {
      if (one.clientWidth) one.classList.toggle("scrolls", one.scrollWidth > one.clientWidth + 1);
    }
  }
  window.addEventListener("resize", markScrolling);
  document.addEventListener("toggle", markScrolling, true);
  markScrolling();

  const search = document.getElementById("search"), count = document.getElementById("count");
  function filter() {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const off = new Set();
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word));
      if (row.hidden) off.add(row.dataset.w);
    }
    for (const mark of document.querySelectorAll(".mark")) mark.classList.toggle("off", off.has(mark.dataset.w));
    count.textContent = `${rows.length - off.size} of ${rows.length} whisks`;
  }
  search.addEventListener("input", filter);
  filter();

  function isCard(element) {
    return element !== null && element.matches("dialog.card");
  }

  function open(key) {
    const card = document.getElementById(key);
    if (!isCard(card) || card.open) return;
    document.querySelectorAll("dialog[open]").forEach((other) => other.close());
    card.showModal();
    card.scrollTop = 0;
    markScrolling();
    history.replaceState(null, "", "#" + key);
    document.dispatchEvent(new CustomEvent("whisk", { detail: key }));
  }

  function go(card, step) {
    const shown = Array.from(body.rows).filter((row) => !row.hidden).map((row) => row.dataset.w);
    const next = shown[shown.indexOf(card.id) + step];
    if (next) open(next);
  }

  document.addEventListener("click", (event) => {
    const link = event.target.closest("a[href^='#']"), card = event.target.closest("dialog.card");
    const key = link && link.getAttribute("href").slice(1);
    if (link && isCard(document.getElementById(key))) { // other links lead to parts of the page
      event.preventDefault();
      open(key);
    } else if (event.target.matches("[data-go]")) {
      const step = Number(event.target.dataset.go);
      if (step) go(card, step);
      else card.close();
    } else if (event.target.matches("dialog.card")) {
      event.target.close(); // the backdrop
    }
  });
  for (const card of document.querySelectorAll("dialog.card")) {
    card.addEventListener("close", () => {
      if (location.hash === "#" + card.id) history.replaceState(null, "", location.pathname + location.search);
    });
    card.addEventListener("keydown", (event) => {
      if (event.key === "ArrowLeft") go(card, -1);
      if (event.key === "ArrowRight") go(card, 1);
    });
  }
  window.addEventListener("hashchange", () => open(location.hash.slice(1)));
  open(location.hash.slice(1));

  const details = Array.from(document.querySelectorAll("details")); // paper cannot unfold them
  let folded = [];
  window.addEventListener("beforeprint", () => {
    folded = details.filter((one) => !one.open);
    folded.forEach((one) => (one.open = true));
  });
  window.addEventListener("afterprint", () => folded.forEach((one) => (one.open = false)));
  document.getElementById("print-cards").addEventListener("change", (event) =>
    document.body.classList.toggle("print-cards", event.target.checked));
})();
