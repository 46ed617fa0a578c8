// Paper cannot be unfolded: what a browser keeps closed in print is opened for it, and closed again afterwards.
let opened = [];

window.addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details.claim:not([open]), details.proof:not([open], .runs-of), figure > details:not([open])")];
  opened.forEach((details) => { details.open = true; });
});
window.addEventListener("afterprint", () => opened.forEach((details) => { details.open = false; }));

// A link into something folded unfolds it.
const unfold = () => {
  const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let place = target; place; place = place.parentElement) if (place.tagName === "DETAILS") place.open = true;
  if (target) target.scrollIntoView();
};
window.addEventListener("hashchange", unfold);
unfold();
