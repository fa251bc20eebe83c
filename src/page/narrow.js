// On a narrow screen the form comes after scene and result, for the eye and for the Tab key alike.

const narrow = matchMedia('(max-width: 760px)');

function order() {
  const form = document.querySelector('.left');
  const focused = form.contains(document.activeElement) ? document.activeElement : null;
  if (narrow.matches) form.parentElement.append(form);
  else form.parentElement.prepend(form);
  focused?.focus();
}

/** Has the form where it belongs, now and whenever the width changes. */
export function keepOrder() {
  order();
  narrow.addEventListener('change', order);
}
