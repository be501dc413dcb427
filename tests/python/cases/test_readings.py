"""The study of the readings of the noise, against the cases' own study, `jointfrf.pollute`, and known densities."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from support.case import case_folder
from support.command import command

import jointfrf as jf
