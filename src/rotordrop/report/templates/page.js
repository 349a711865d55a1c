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
  var waiting = Array.prototype.slice.call(document.querySelectorAll(".chart"));
  var drawn = [];

  function draw(element) {
    var description = JSON.parse(document.getElementById(element.id + "-data").textContent);
    drawn.push(element);
    return Plotly.newPlot(element, description.data, description.layout, settings);
  }

  function drawNext() {
    var element = waiting.shift();
    if (!element) { document.documentElement.setAttribute("data-drawn", String(drawn.length)); return; }
    draw(element);
    window.setTimeout(drawNext, 0);
  }

  function resize(width, share) {
    drawn.forEach(function (element) {
      var height = Math.round(share * Number(element.getAttribute("data-height")));
      element.style.height = height + "px";
      Plotly.relayout(element, { width: width, height: height, autosize: width === null });
    });
  }

  window.addEventListener("beforeprint", function () {
    while (waiting.length) { draw(waiting.shift()); }
    resize(695, 0.65);
  });
  window.addEventListener("afterprint", function () { resize(null, 1.0); });
  drawNext();
})();
