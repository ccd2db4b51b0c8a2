// Small helpers for the page's elements.

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @param {{new (): T}} type
 * @returns {T}
 */
export function element(id, type) {
  const found = document.getElementById(id);
  if (!(found instanceof type)) throw new Error(`the page lacks #${id}`);
  return found;
}

/**
 * Returns a number with four or five digits.
 * @param {number} x
 */
export function shortNumber(x) {
  const size = Math.abs(x);
  const text = size < 1e-12 ? "0" : size < 1e-3 || size >= 1e6 ? String(Number(x.toPrecision(4)).toExponential()) : String(Number(x.toPrecision(5)));
  return text.replaceAll("-", "−");
}

/**
 * Fills a list with names and values.
 * @param {HTMLElement} list
 * @param {[string, string][]} rows
 */
export function setRows(list, rows) {
  list.replaceChildren(
    ...rows.flatMap(([name, value]) => {
      const term = document.createElement("dt");
      const description = document.createElement("dd");
      term.textContent = name;
      description.textContent = value;
      return [term, description];
    }),
  );
}

/**
 * Gives a selection these choices: values and texts.
 * @param {HTMLSelectElement} select
 * @param {[string, string][]} choices
 * @param {string} chosen
 */
export function setChoices(select, choices, chosen) {
  const known = [...select.options].map(({ value, text }) => `${value} ${text}`).join();
  if (known !== choices.map(([value, text]) => `${value} ${text}`).join()) select.replaceChildren(...choices.map(([value, text]) => new Option(text, value)));
  select.value = chosen;
}
