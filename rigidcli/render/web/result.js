// Formulas that are wider than their place are set smaller, as far as they can be read.
const LEAST = 0.7;  // of their size

const fit = () => {
  for (const place of document.querySelectorAll(".rigidcli :is(.results td, .formula)")) {
    place.style.fontSize = "";
    const share = place.clientWidth / place.scrollWidth;
    if (share < 1) place.style.fontSize = `${100 * Math.max(share - 0.01, LEAST)}%`;
  }
};
addEventListener("resize", fit);
document.fonts.ready.then(fit);
fit();
