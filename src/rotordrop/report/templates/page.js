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
  var waiting = Array.prototype.slice.call(document.querySelectorAll(".chart"));
  var drawn = [];

  function described(element, onDark) {
    var text = document.getElementById(element.id + "-data").textContent;
    return JSON.parse(onDark ? text.replace(colours, function (one) { return dark[one]; }) : text);
  }

  function draw(element) {
    var description = described(element, night.matches);
    drawn.push(element);
    return Plotly.newPlot(element, description.data, description.layout, settings);
  }

  function drawNext() {
    var element = waiting.shift();
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

  function resize(width, share) {
    drawn.forEach(function (element) {
      var first = element.closest(".front") ? 1.0 : share;
      var height = Math.round(first * Number(element.getAttribute("data-height")));
      element.style.height = height + "px";
      Plotly.relayout(element, { width: width, height: height, autosize: width === null });
    });
  }

  function fold(open) {
    Array.prototype.forEach.call(document.querySelectorAll("details"), function (part) { part.open = open; });
  }

  night.addEventListener("change", function () { redraw(night.matches); });
  window.addEventListener("beforeprint", function () {
    while (waiting.length) { draw(waiting.shift()); }
    if (night.matches) { redraw(false); }
    fold(true);
    resize(695, 0.65);
  });
  window.addEventListener("afterprint", function () {
    if (night.matches) { redraw(true); }
    fold(false);
    resize(null, 1.0);
  });
  drawNext();
})();
