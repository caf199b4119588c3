// Tables that sort by a column: a button in each heading.
const NUMBER = /-?\d+(\.\d+)?(e-?\d+)?/;

function sortValue(row, column) {
  const text = row.cells[column] ? row.cells[column].textContent.trim() : '';
  const found = NUMBER.exec(text);
  return found && found.index < 3 ? [0, parseFloat(found[0]), text] : [1, 0, text];
}

function compareValues(a, b) {
  return a[0] - b[0] || a[1] - b[1] || a[2].localeCompare(b[2], undefined, {numeric: true});
}

function sortBy(table, column) {
  const heading = table.tHead.rows[0].cells[column];
  const rising = heading.getAttribute('aria-sort') === 'descending' ||
    (!heading.hasAttribute('aria-sort') && !heading.classList.contains('number'));
  for (const cell of table.tHead.rows[0].cells) cell.removeAttribute('aria-sort');
  heading.setAttribute('aria-sort', rising ? 'ascending' : 'descending');
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row, place) => ({row, place, value: sortValue(row, column)}));
  rows.sort((a, b) => (rising ? 1 : -1) * compareValues(a.value, b.value) || a.place - b.place);
  body.append(...rows.map((r) => r.row));
}

function makeSortable(table) {
  [...table.tHead.rows[0].cells].forEach((cell, column) => {
    const button = document.createElement('button');
    button.type = 'button';
    button.textContent = cell.textContent;
    button.addEventListener('click', () => sortBy(table, column));
    cell.replaceChildren(button);
  });
}
