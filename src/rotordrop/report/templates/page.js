"use strict";
(function () {
  var settings = {
    displaylogo: false,
    responsive: true,
    plotlyServerURL: "",
    showSendToCloud: false,
    modeBarButtonsToRemove: ["lasso2d", "select2d"],
    toImageButtonOptions: { format: "svg", filename: "rotordrop" }
  };
  // colours of the figures on dark paper; what stays white on both, as the lines on a map, is written #fff
  var dark = {
    "#ffffff": "#161c22", "#1c2733": "#e3e9ef", "#20262d": "#e3e9ef", "#5b6875": "#9fb0c0", "#e6eaee": "#2c3742",
    "#9aa6b2": "#5f6d7a", "#cbd4dc": "#3a4651", "#6b7785": "#93a1ae", "#0b3d73": "#cfe4fa", "#9cc3e8": "#2c6aa8",
    "#b9c3cd": "#4d5a66", "#9fb3c8": "#5d7186", "#dbe4ec": "#39444f", "#0b62b8": "#5aa7ee", "#b3261e": "#f0857d",
    "rgba(255,255,255,0.85)": "rgba(22,28,34,0.85)"
  };
  var colours = new RegExp(Object.keys(dark).map(function (one) { return one.replace(/[.()]/g, "\\$&"); }).join("|"), "g");
  var night = window.matchMedia("(prefers-color-scheme: dark)");
  var hidden = "details:not([open])";
  var charts = list(".chart");
  var drawn = [];

  function list(selector) { return Array.prototype.slice.call(document.querySelectorAll(selector)); }
  function waiting() {
    return charts.filter(function (one) { return drawn.indexOf(one) < 0 && !one.closest(hidden); });
  }

  function described(element, onDark) {
    var text = document.getElementById(element.id + "-data").textContent;
    return JSON.parse(onDark ? text.replace(colours, function (one) { return dark[one]; }) : text);
  }

  // figures keep the width that their words need; where there is less room they are made smaller as a whole
  function fit(element) {
    var share = Math.min(1, element.parentNode.clientWidth / 560);
    element.style.width = share < 1 ? "560px" : "";
    element.style.transform = share < 1 ? "scale(" + share + ")" : "";
    element.style.marginBottom = (share - 1) * Number(element.getAttribute("data-height")) + "px";
  }

  function draw(element) {
    var description = described(element, night.matches);
    fit(element);
    drawn.push(element);
    return Plotly.newPlot(element, description.data, description.layout, settings);
  }

  function drawNext() {
    var element = waiting()[0];
    if (!element) { document.documentElement.setAttribute("data-drawn", String(drawn.length)); return; }
    draw(element);
    window.setTimeout(drawNext, 0);
  }

  function redraw(onDark) {
    drawn.forEach(function (element) {
      var description = described(element, onDark);
      Plotly.react(element, description.data, description.layout, settings);
    });
  }

  // on paper figures are drawn wide and then made smaller, so that words keep clear of each other; those of the front
  // are flat, and all but the first stand beside words, so that the front is one page
  function resize(onPaper) {
    drawn.forEach(function (element) {
      var front = element.closest(".front"), beside = element.closest(".front > .beside");
      var width = onPaper ? (beside ? 535 : 985) : null;
      var height = Math.round((onPaper ? (beside ? 0.6 : front ? 0.76 : 0.62) : 1.0) * Number(element.getAttribute("data-height")));
      element.style.height = height + "px";
      element.style.transform = element.style.marginBottom = "";
      element.style.width = onPaper ? width + "px" : "";
      element.style.zoom = onPaper ? "0.7" : "";
      Plotly.relayout(element, { width: width, height: height, autosize: !onPaper });
      if (!onPaper) { fit(element); }
    });
  }

  function unfold(selector) {
    var closed = list(selector);
    closed.forEach(function (part) { part.open = true; });
    return closed;
  }

  // a link into the appendix opens the part it leads to
  function reveal() {
    var part = location.hash && document.getElementById(location.hash.slice(1));
    if (part && part.matches(hidden)) { part.open = true; part.scrollIntoView(); }
  }
  var opener = document.getElementById("unfold"), closed = [];
  if (opener) { opener.addEventListener("click", function () { unfold(hidden); }); }
  list(".contents a").forEach(function (one) { one.addEventListener("click", function () { window.setTimeout(reveal, 0); }); });
  window.addEventListener("hashchange", reveal);
  document.addEventListener("toggle", drawNext, true);

  window.addEventListener("resize", function () { drawn.forEach(fit); });
  if (window.self !== window.top) { document.documentElement.classList.add("framed"); }
  night.addEventListener("change", function () { redraw(night.matches); });
  window.addEventListener("beforeprint", function () {
    closed = unfold(".printed:not([open])");
    waiting().forEach(draw);
    if (night.matches) { redraw(false); }
    resize(true);
  });
  window.addEventListener("afterprint", function () {
    if (night.matches) { redraw(true); }
    closed.forEach(function (part) { part.open = false; });
    resize(false);
  });
  reveal();
  drawNext();
})();
