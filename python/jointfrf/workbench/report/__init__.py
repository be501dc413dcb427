"""What people look at: tables, figures, pages. Of cases it knows nothing; cases and `jointfrf identify` both use it.

table        a table as data; as aligned text, as CSV, and its cells as a reader wants them
figure       a figure as data: curves, areas, levels, intervals, shaded surfaces on panels; as CSV
axes         what several figures share: labels with units, limits of axes and numbers along them, percentiles
receptance   receptances: modulus and phase below each other; the noise found in them
draw         a figure drawn by matplotlib to a PNG and an SVG file
chart        a figure as part of a page, which a script zooms
sketch       the channels around a joint; the parts of an assembly with sensors and hits
document     one self-contained HTML page from sentences, tables, figures and texts
fit          figures of an identification and of where its information lies; its files
fit_frfs     measured FRFs against those regenerated or predicted; maps of agreement and residual
fit_words    what a fit has found and what to measure next, in sentences and tables
fit_page     the page on an identification
plan_page    a planned test: where sensors and hits go, where the knowledge lies
levels_page  a joint at several levels, modes of a free decay: curves over amplitude, a page
pool_page    fits of one joint in several assemblies: forest plots, a page
"""
