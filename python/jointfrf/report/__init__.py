"""What people look at: tables, figures, pages. Of cases it knows nothing; cases and `jointfrf identify` both use it.

table        a table as data; as aligned text, as CSV, and its cells as a reader wants them
figure       a figure as data: curves, areas, levels, intervals, shaded surfaces on panels; as CSV
ticks        numbers along axes: SI prefixes, and few enough not to collide
receptance   receptances: modulus and phase below each other
axes         what several figures share: labels with units, limits of axes, percentiles
draw         a figure drawn to a PNG and an SVG file
svg          SVG in a quarter of its length
solid_modes  mode shapes of solids as shaded surfaces
page         one self-contained HTML page from sentences, tables, figures and texts
fit          the files of one identification: parameters as JSON, figures of the joint over frequency
"""
