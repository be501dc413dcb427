"""Tables, figures and pages, for cases and for the command line; independent of kinds of cases.

table        a table as data; as aligned text, as CSV, and as formatted cells
figure       a figure as data: curves, areas, levels, intervals, shaded surfaces on panels; as CSV
axes         labels with units, limits of axes and numbers along them, percentiles
receptance   receptances: modulus and phase below each other; the estimated noise
draw         a figure drawn by matplotlib to a PNG and an SVG file
chart        a figure as part of a page, which a script zooms
sketch       the channels around a joint; the parts of an assembly with sensors and impacts
document     one self-contained HTML page from sentences, tables, figures and texts
fit          figures of an identification and of its information over frequency; its files
fit_frfs     measured FRFs against those regenerated or predicted; maps of agreement and residual
fit_words    results of a fit and recommended measurements, in sentences and tables
fit_page     the page on an identification
plan_page    a planned test: places of sensors and impacts, information over frequency
levels_page  a joint at several levels, modes of a free decay: curves over amplitude, a page
pool_page    fits of one joint in several assemblies: forest plots, a page
"""
