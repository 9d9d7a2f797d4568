// uPlot draws the heading over time with zoom and a cursor; its style sheet becomes uplot.css beside it.
import "uplot/dist/uPlot.min.css";
export { default } from "uplot";
