"""All messages about data and fits: one table of codes, and the findings that fill it.

finding         a finding: code, severity, numbers; its sentence is the message of the code
message         one row of the table
of_data         the messages of the data checks
of_fits         the messages of fits, levels, pools and plans
"""
