"""Figures, pages and terminal summaries: data in, figure or page out.

Every figure family is one module with functions that take plain histories and give a plotly figure. Every
verb has a builder that puts them into a `rotordrop.report.content.ReportContent`; `rotordrop.report.page`
writes that as one offline HTML file and `rotordrop.report.terminal` as a summary for the terminal.
"""
