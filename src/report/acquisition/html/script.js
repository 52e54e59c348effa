"use strict";
// A click on a heading sorts its table: by the numbers of a column, or by its names; another click
// turns the order.
function sortable(tables) {
  for (const table of tables) {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const key = row => {
        const text = row.cells[column].textContent.trim().replace("−", "-");
        const number = parseFloat(text.replace(/^[<×#]\s*/, ""));
        return { text, number, empty: text === "" || text === "–" };
      };
      const button = document.createElement("button");
      button.append(...head.childNodes);
      button.title = "Sort";
      head.append(button);
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        const rows = [...table.tBodies].flatMap(body => [...body.rows]).map(row => [key(row), row]);
        const numbers = rows.every(([k]) => k.empty || !Number.isNaN(k.number));
        // What is empty stays last.
        rows.sort(([a], [b]) => a.empty - b.empty || (down ? -1 : 1)
          * (numbers ? a.number - b.number || 0 : a.text.localeCompare(b.text, "en", { numeric: true })));
        for (const other of heads) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        table.classList.add("sorted");
        table.tBodies[0].append(...rows.map(([, row]) => row));
        for (const body of [...table.tBodies].slice(1)) body.remove();
      });
    });
  }
}
// Long parts that are folded away are deflated, and inflated where they are opened.
async function inflate(part) {
  try {
    const bytes = Uint8Array.from(atob(part.dataset.deflated), letter => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    part.innerHTML = await new Response(stream).text();
    part.removeAttribute("data-deflated");
  } catch {
    part.textContent = "This browser cannot show this part: it has no DecompressionStream.";
  }
  prepare(part);
}
function prepare(whole) {
  sortable(whole.querySelectorAll("table.sorts"));
  for (const part of whole.querySelectorAll("[data-deflated]")) {
    part.closest("details").addEventListener("toggle", () => inflate(part), { once: true });
  }
}
prepare(document);
